/** Entry of a book without a server. */
import { furnish, furnishText, rootOfBook } from "./furniture";
import "../styles/theme.css";
import "../styles/base.css";
import "./book.css";

furnish(rootOfBook());
furnishText(document);
