/** The elements that a page of another origin may use: one script tag, then `<busflow-…>`. */
import { PANELS } from "../panels/registry";

for (const panel of PANELS) console.debug(panel.kind);
