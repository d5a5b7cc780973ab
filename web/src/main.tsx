import "./ui/tokens.css";
import { createRoot } from "react-dom/client";
import texts from "virtual:texts/studio";
import { HttpService } from "./api/http";
import { connectTo } from "./api/service";
import { startTexts } from "./i18n";
import { startSettings } from "./state/settings";

startSettings();
// Fetched beside each other.
const [{ App }, { start }] = await Promise.all([import("./app/App"), import("./app/start"), startTexts(texts)]);
connectTo(new HttpService());
start();
createRoot(document.getElementById("root")!).render(<App />);
