/** The zones of a mission on the floor, below the cars. */

import { Container, Graphics, Text, type TextStyleOptions } from "pixi.js";
import type { MissionZone } from "../generated/messages";
import { inLanguage } from "../i18n";
import { boxOfZone } from "./camera";
import { type MatTheme, pageFont } from "./colours";
import { mm } from "./layers";

// Legible on each floor, by day and by night.
const NAME_STYLE: Partial<TextStyleOptions> = {
  fontSize: 14,
  fontWeight: "bold",
  fill: 0xffffff,
  stroke: { color: 0x14213d, width: 4, join: "round" },
  align: "center",
  wordWrap: true,
  wordWrapWidth: 110,
};

/** Between the edge of a zone and its name. */
const NAME_AIR_PX = 4;

export class ZoneLayer {
  readonly view = new Container();
  private readonly areas = new Graphics();
  private readonly names = new Container<Text>();
  zones: readonly MissionZone[] = [];
  private drawnFor = "";

  constructor(private theme: MatTheme) {
    this.view.addChild(this.areas, this.names);
  }

  setTheme(theme: MatTheme): void {
    this.theme = theme;
    this.drawnFor = "";
  }

  setZones(zones: readonly MissionZone[]): void {
    this.zones = zones;
    this.drawnFor = "";
  }

  /** Where the names are on the canvas. */
  nameBoxes(): DOMRect[] {
    return this.names.children.map((name) => {
      const { x, y, width, height } = name.getBounds();
      return new DOMRect(x, y, width, height);
    });
  }

  /** Lines and letters are as large on the screen at any `scale`, in pixels a millimetre. */
  draw(scale: number): void {
    const drawnFor = scale.toPrecision(3);
    if (drawnFor === this.drawnFor) return;
    this.drawnFor = drawnFor;
    const g = this.areas.clear();
    for (const name of this.names.removeChildren()) name.destroy();
    for (const zone of this.zones) {
      const { title, corners_m, centre_m, radius_m } = zone;
      if (centre_m) g.circle(centre_m[0]! * 1000, centre_m[1]! * 1000, radius_m! * 1000);
      else g.poly(mm(corners_m));
      g.fill({ color: this.theme.accent, alpha: 0.18 }).stroke({ width: 2 / scale, color: this.theme.accent, alpha: 0.9 });
      const name = this.names.addChild(new Text({ text: inLanguage(title), style: { ...NAME_STYLE, fontFamily: pageFont() } }));
      // The world's y axis goes up.
      name.scale.set(1 / scale, -1 / scale);
      // At the upper edge, since cars come to the middle.
      name.anchor.set(0.5, 0);
      const { left, right, top } = boxOfZone(zone);
      name.position.set((left + right) * 500, top * 1000 - NAME_AIR_PX / scale);
    }
  }
}
