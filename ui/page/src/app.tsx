/** The page's entry: opens the session and renders the shell. */
import { render } from "preact";
import { socketAddress } from "./components/sessions";
import { Shell } from "./shell/shell";
import { Session } from "./store/session";
import { takeToken } from "./store/token";
import { applyTheme } from "./shell/theme";
import "./styles/app.css";

applyTheme();

const session = new Session({ url: socketAddress(new URL(".", location.href).href), token: takeToken() });
const root = document.getElementById("app");
if (root === null) throw new Error("index.html has no element #app");
session.connect(); // before the drawing, during which the server answers
render(<Shell session={session} />, root);
