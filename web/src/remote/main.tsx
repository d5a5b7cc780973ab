import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import texts from "virtual:texts/remote";
import { startTexts } from "../i18n";
import { startSettings } from "../state/settings";
import { startDriving } from "./input";
import { Remote } from "./Remote";

startSettings();
startDriving();
await startTexts(texts);
createRoot(document.getElementById("root")!).render(<Remote />);
