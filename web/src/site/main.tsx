/** The studio as static files. */

import "../main";
import { startOffline } from "./offline";

void startOffline();
