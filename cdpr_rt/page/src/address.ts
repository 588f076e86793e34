// What follows # in the page's address: the view and its arguments (#scope&file=run.mcap), and once the key (#key=...).
import { useEffect, useState } from "preact/hooks";

const KEY = "cdpr-key";
const FIRST_VIEW = "robot";

const fragment = (): URLSearchParams => new URLSearchParams(location.hash.slice(1));

const viewOf = (parts: URLSearchParams): string => [...parts.keys()].find((name) => name !== "key" && parts.get(name) === "") ?? FIRST_VIEW;

/** Return the fragment that shows a view. */
export const linkTo = (view: string, args: Record<string, string> = {}): string =>
  `#${[view, ...(Object.keys(args).length ? [new URLSearchParams(args)] : [])].join("&")}`;

/** Take the key from the address, where `cdpr run` puts it, and keep it for this tab. */
export function takeKey(): string {
  const parts = fragment();
  const given = parts.get("key");
  if (given) {
    sessionStorage.setItem(KEY, given);
    history.replaceState(null, "", linkTo(viewOf(parts)));
  }
  return sessionStorage.getItem(KEY) ?? "";
}

export const keepKey = (key: string): void => sessionStorage.setItem(KEY, key);

// an address with another key, entered while the page is open, loads nothing by itself
addEventListener("hashchange", () => fragment().has("key") && location.reload());

/** Redraw the calling component whenever the view changes; return the view's name and arguments. */
export function useView(): { view: string; args: URLSearchParams } {
  const [parts, change] = useState(fragment);
  useEffect(() => {
    const changed = (): void => change(fragment());
    addEventListener("hashchange", changed);
    return () => removeEventListener("hashchange", changed);
  }, []);
  return { view: viewOf(parts), args: parts };
}
