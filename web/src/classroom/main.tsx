import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import { startSettings } from "../state/settings";
import { Join } from "./Join";
import { Privacy } from "./Privacy";
import { Teacher } from "./Teacher";
import { SharedMat, WallPage } from "./WallPage";
import { startLanguages } from "./texts";

const PAGES: Record<string, () => React.ReactNode> = {
  "/join": Join,
  "/teacher": Teacher,
  "/wall": WallPage,
  "/mat": SharedMat,
  "/privacy": Privacy,
};

startSettings();
startLanguages();
const Page = PAGES[location.pathname] ?? Join;
createRoot(document.getElementById("root")!).render(<Page />);
