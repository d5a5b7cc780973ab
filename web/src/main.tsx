import "./ui/tokens.css";
import { createRoot } from "react-dom/client";
import { HttpService } from "./api/http";
import { connectTo } from "./api/service";
import { App } from "./app/App";
import { start } from "./app/start";

connectTo(new HttpService());
start();
createRoot(document.getElementById("root")!).render(<App />);
