import "./app/styles.css";
import { createRoot } from "react-dom/client";
import { App } from "./app/App";
import { startLanguages } from "./i18n";

startLanguages();
createRoot(document.getElementById("root")!).render(<App />);
