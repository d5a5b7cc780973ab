import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import { startDriving } from "./input";
import { Remote } from "./Remote";
import { startSettings } from "../state/settings";
import { startLanguages } from "./texts";

startSettings();
startLanguages();
startDriving();
createRoot(document.getElementById("root")!).render(<Remote />);
