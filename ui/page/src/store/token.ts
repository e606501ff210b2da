/** The token of `busflow ui`: taken from the address once, then kept for this tab alone. */

const KEY = "busflow-token";

export interface FragmentAndToken {
  readonly token: string | null;
  /** The fragment without the token. */
  readonly fragment: string;
}

/** Splits a fragment such as `#token=abc&layout=…` into its token and the rest. */
export function splitToken(fragment: string): FragmentAndToken {
  const parts = fragment.replace(/^#/, "").split("&").filter(Boolean);
  const token = parts.find((part) => part.startsWith("token="));
  const rest = parts.filter((part) => part !== token).join("&");
  return {
    token: token === undefined ? null : decodeURIComponent(token.slice("token=".length)),
    fragment: rest === "" ? "" : `#${rest}`,
  };
}

/** Returns the token of the address or of this tab's storage, and takes it out of the address. */
export function takeToken(): string {
  const { token, fragment } = splitToken(location.hash);
  if (token !== null) {
    sessionStorage.setItem(KEY, token);
    history.replaceState(null, "", location.pathname + location.search + fragment);
  }
  return token ?? sessionStorage.getItem(KEY) ?? "";
}
