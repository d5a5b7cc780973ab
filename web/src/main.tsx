import "./ui/tokens.css";
import { createRoot } from "react-dom/client";
import { App } from "./app/App";
import { start } from "./app/start";

start();
createRoot(document.getElementById("root")!).render(<App />);
