/** Entry of a book without a server. */
import { addControls, addCopyButtons, rootOfBook } from "./controls";
import "../styles/theme.css";
import "../styles/base.css";
import "./book.css";

addControls(rootOfBook());
addCopyButtons(document);
