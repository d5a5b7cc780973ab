import "../app/tokens.css";
import "../app/buttons.css";
import "./remote.css";
import { createRoot } from "react-dom/client";
import { Remote } from "./Remote";
import { startLanguages } from "./texts";

startLanguages();
createRoot(document.getElementById("root")!).render(<Remote />);
