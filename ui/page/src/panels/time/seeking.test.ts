import assert from "node:assert/strict";
import test from "node:test";
import { Seeking, type Seek } from "./seeking";

/** Answers, one after another, when the test says so. */
function fixture() {
  const [asked, faults] = [[] as Seek[], [] as unknown[]];
  let settle: { resolve: () => void; reject: (error: Error) => void } | undefined;
  const seeking = new Seeking(
    (seek) => {
      asked.push(seek);
      return new Promise<void>((resolve, reject) => (settle = { resolve, reject }));
    },
    (error) => faults.push(error),
  );
  const answer = async (error?: Error): Promise<void> => {
    if (error === undefined) settle?.resolve();
    else settle?.reject(error);
    await new Promise(setImmediate);
  };
  return { seeking, asked, faults, answer };
}

test("of many places the last is asked for", async () => {
  const { seeking, asked, answer } = fixture();
  for (const stamp of ["1", "2", "3"]) seeking.seek({ stamp_ns: stamp });
  assert.deepEqual(asked, [{ stamp_ns: "1" }]);
  await answer();
  await answer();
  assert.deepEqual(asked, [{ stamp_ns: "1" }, { stamp_ns: "3" }]);
});

test("what is asked meanwhile goes together", async () => {
  const { seeking, asked, answer } = fixture();
  seeking.seek({ play: false });
  seeking.seek({ stamp_ns: "5" });
  seeking.seek({ rate: 2 });
  await answer();
  assert.deepEqual(asked[1], { stamp_ns: "5", rate: 2 });
});

test("a refusal ends what was waiting", async () => {
  const { seeking, asked, faults, answer } = fixture();
  seeking.seek({ stamp_ns: "1" });
  seeking.seek({ stamp_ns: "2" });
  await answer(new Error("no"));
  assert.deepEqual([asked.length, String(faults[0])], [1, "Error: no"]);
  seeking.seek({ stamp_ns: "3" });
  assert.equal(asked.length, 2);
});
