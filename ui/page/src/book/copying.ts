/** Copying of code: what is worth copying. Pure. */

/** Returns of a console its commands, and any other code as it is. */
export function copiedText(code: string, language: string | undefined): string {
  if (language !== "console") return code;
  const commands = code.split("\n").filter((each) => each.startsWith("$ "));
  return commands.length === 0 ? code : `${commands.map((each) => each.slice(2)).join("\n")}\n`;
}
