import assert from "node:assert/strict";
import { test } from "node:test";
import { CallError, Services } from "./services";

const RESET = { id: 3, name: "/reset", type: "std_srvs/srv/Trigger" };

function offering(isOpen = true) {
  const services = new Services({ sendBytes: () => isOpen });
  services.handle({ op: "advertiseServices", services: [RESET] });
  return services;
}

test("an answer finds its call", async () => {
  const services = offering();
  const answer = services.call(RESET, new Uint8Array(), 1000);
  const data = new DataView(new ArrayBuffer(1));
  services.handle({ op: "callAnswered", service: 3, call: 1, encoding: "cdr", data });
  assert.equal(await answer, data);
});

test("a failure comes in the server's words", async () => {
  const services = offering();
  const answer = services.call(RESET, new Uint8Array(), 1000);
  services.handle({ op: "serviceCallFailure", serviceId: 3, callId: 1, message: "it raised ValueError" });
  await assert.rejects(answer, new CallError("it raised ValueError"));
});

test("a call has a time limit", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const answer = offering().call(RESET, new Uint8Array(), 1500);
  context.mock.timers.tick(1500);
  await assert.rejects(answer, /No answer within 1.5 s/);
});

test("an end of the connection ends all calls", async () => {
  const services = offering();
  const answer = services.call(RESET, new Uint8Array(), 1000);
  services.ended();
  await assert.rejects(answer, /connection ended/);
  assert.equal(services.offered.value.size, 0);
  await assert.rejects(offering(false).call(RESET, new Uint8Array(), 1000), /no connection/);
});

test("a service that goes is no longer offered", () => {
  const services = offering();
  assert.deepEqual([...services.offered.value.keys()], ["/reset"]);
  services.handle({ op: "unadvertiseServices", serviceIds: [3] });
  assert.equal(services.offered.value.size, 0);
});
