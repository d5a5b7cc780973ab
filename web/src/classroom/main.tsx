import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import { startSettings } from "../state/settings";
import { Join } from "./Join";
import { Privacy } from "./Privacy";
import { Teacher } from "./Teacher";
import { SharedMat, TeacherOnly, WallPage } from "./WallPage";
import { startLanguages } from "./texts";

const PAGES: Record<string, () => React.ReactNode> = {
  "/join": Join,
  "/teacher": Teacher,
  "/wall": () => <TeacherOnly title="wallTitle"><WallPage /></TeacherOnly>,
  "/mat": () => <TeacherOnly title="matTitle"><SharedMat /></TeacherOnly>,
  "/privacy": Privacy,
};

startSettings();
startLanguages();
const Page = PAGES[location.pathname] ?? Join;
createRoot(document.getElementById("root")!).render(<Page />);
