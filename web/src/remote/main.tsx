import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import { Remote } from "./Remote";
import { startSettings } from "../state/settings";
import { startLanguages } from "./texts";

startSettings();
startLanguages();
createRoot(document.getElementById("root")!).render(<Remote />);
