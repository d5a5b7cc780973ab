/** What every page says where requests reach its server and WebSockets don't. */

import { useSockets } from "../api/connection";
import { useTexts } from "../i18n";
import areas from "./areas.module.css";

export function SocketNotice() {
  const t = useTexts("network");
  const blocked = useSockets((state) => state.blocked);
  return blocked && <p role="alert" className={areas.warning}>{t("noSockets", { host: location.host })}</p>;
}
