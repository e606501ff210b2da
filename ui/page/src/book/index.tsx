/** Entry of a book that a server is behind: the text beside the run, and the assistant. */
import { mountAssistant } from "../assistant/assistant";
import { Talk, type About } from "../assistant/talk";
import { share } from "../components/sessions";
import { takeToken } from "../store/token";
import { showCitation } from "./citing";
import { addControls, addCopyButtons, rootOfBook } from "./controls";
import { showLiveParts } from "./live";
import { Navigation } from "./navigation";
import "../styles/theme.css";
import "../styles/base.css";
import "../assistant/assistant.css";
import "./book.css";

const root = rootOfBook();
const token = takeToken();
// The panels in the text have the same connection: they name the same server and token.
const session = share(new URL(".", import.meta.url).href, token);

addControls(root);
addCopyButtons(document);
const live = showLiveParts(session, token);
const navigation = new Navigation(root, () => {
  addCopyButtons(document);
  live.update();
});

const place = document.createElement("div");
document.body.append(place);
mountAssistant(place, {
  session,
  talk: new Talk(sessionStorage),
  root: () => document.querySelector("article"),
  whole,
  show: (citation, about) => void showCitation(citation, about, navigation, root),
});

function whole(): About {
  const { page = "", title = document.title } = document.getElementById("text")?.dataset ?? {};
  return { chapter: page, title, selection: "", isCut: false, isWholePage: false };
}
