/** What every page says where requests reach its server and WebSockets don't. */

import languages, { type Texts } from "virtual:texts/network";
import { useSockets } from "../api/connection";
import { plainTexts } from "../i18n/plain";
import areas from "../ui/areas.module.css";

const { textIn } = plainTexts<Texts>(languages);

export function SocketNotice({ language }: { language: string }) {
  const blocked = useSockets((state) => state.blocked);
  return blocked && <p role="alert" className={areas.warning}>{textIn(language, "noSockets", { host: location.host })}</p>;
}
