import type { Picture } from "../api/world";
import type { MissionZone } from "../generated/messages";
import type { Wave } from "./airLayer";
import type { Drawn } from "./carLayer";
import type { MatTheme, WordColours } from "./colours";
import type { FloorName, Mat } from "./document";

/** What a view from another side draws. */
export interface Sight {
  mat: Mat | null;
  zones: readonly MissionZone[];
  drawn: Drawn;
  picture: Picture | null;
  leads: ReadonlySet<number>;
  carM: number;
  colours: WordColours;
  theme: MatTheme;
  floor: FloorName;
  contrast: boolean;
  waves: readonly Wave[];
}
