import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import texts from "virtual:texts/class";
import { startTexts } from "../i18n";
import { startSettings } from "../state/settings";

const join = () => import("./Join").then(({ Join }) => Join);
/** What shows each address: each page fetches its own part alone. */
const PAGES: Record<string, () => Promise<() => React.ReactNode>> = {
  "/join": join,
  "/teacher": () => import("./Teacher").then(({ Teacher }) => Teacher),
  "/wall": () => import("./WallPage").then(({ Wall }) => Wall),
  "/mat": () => import("./WallPage").then(({ SharedMat }) => SharedMat),
  "/privacy": () => import("./Privacy").then(({ Privacy }) => Privacy),
};

startSettings();
const [Page] = await Promise.all([(PAGES[location.pathname] ?? join)(), startTexts(texts)]);
createRoot(document.getElementById("root")!).render(<Page />);
