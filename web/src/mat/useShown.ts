import { useSyncExternalStore } from "react";
import type { Picture } from "../api/world";
import { session } from "./session";

const listen = (changed: () => void) => session.listen(changed);

/** What the newest picture shows, such as a text or a number; null where there is no picture. Drawn again only where it differs. */
export function useShown<Shown extends string | number>(show: (picture: Picture | null) => Shown): Shown {
  return useSyncExternalStore(listen, () => show(session.picture));
}
