/** The kinds of a mission's goals, and the keys of each. Written by scripts/generate.py; don't edit. */

export const GOAL_KINDS = {
  "in-zone": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "zone", "input": "zone"},
    {"name": "at", "input": "at", "first": "end"},
    {"name": "from_s", "input": "number", "least": 0, "most": 600, "whole": false},
    {"name": "until_s", "input": "number", "least": 0, "most": 600, "whole": false},
  ],
  "out-of-zone": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "zone", "input": "zone"},
    {"name": "at", "input": "at", "first": "always"},
    {"name": "from_s", "input": "number", "least": 0, "most": 600, "whole": false},
    {"name": "until_s", "input": "number", "least": 0, "most": 600, "whole": false},
  ],
  "travelled": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "least_m", "input": "number", "first": 1, "least": 0.001, "most": 2000, "whole": false},
    {"name": "most_m", "input": "number", "least": 0.001, "most": 2000, "whole": false},
  ],
  "heading": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "degrees", "input": "number", "first": 1, "least": -360, "most": 360, "whole": false},
    {"name": "tolerance_deg", "input": "number", "first": 15, "least": 1, "most": 180, "whole": false},
    {"name": "at", "input": "at", "first": "end"},
    {"name": "from_s", "input": "number", "least": 0, "most": 600, "whole": false},
    {"name": "until_s", "input": "number", "least": 0, "most": 600, "whole": false},
  ],
  "not-lit": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "led", "input": "led", "first": 0},
    {"name": "from_s", "input": "number", "least": 0, "most": 600, "whole": false},
    {"name": "until_s", "input": "number", "least": 0, "most": 600, "whole": false},
  ],
  "lit": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "led", "input": "led", "first": 0},
    {"name": "at", "input": "at", "first": "some-moment"},
    {"name": "from_s", "input": "number", "least": 0, "most": 600, "whole": false},
    {"name": "until_s", "input": "number", "least": 0, "most": 600, "whole": false},
  ],
  "together": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "metres", "input": "number", "first": 1, "least": 0.001, "most": 2000, "whole": false},
    {"name": "at", "input": "at", "first": "end"},
  ],
  "in-step": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
    {"name": "within_ms", "input": "number", "first": 1, "least": 1, "most": 10000, "whole": true},
  ],
  "no-touch": [],
  "heard": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
  ],
  "stopped-by-voice": [
    {"name": "who", "input": "who", "first": "all"},
    {"name": "share", "input": "number", "first": 1, "least": 0.01, "most": 1, "whole": false},
  ],
  "words-at-most": [{"name": "count", "input": "number", "first": 1, "least": 0, "most": 255, "whole": true}],
  "states-at-most": [{"name": "count", "input": "number", "first": 1, "least": 0, "most": 255, "whole": true}],
  "seconds-at-most": [{"name": "seconds", "input": "number", "first": 1, "least": 0.1, "most": 600, "whole": false}],
  "gathered": [
    {"name": "zone", "input": "zone"},
    {"name": "least", "input": "number", "first": 1, "least": 0.01, "most": 1000000, "whole": false},
  ],
  "stopped": [
    {"name": "zone", "input": "zone"},
    {"name": "least", "input": "number", "first": 1, "least": 0.01, "most": 1000000, "whole": false},
  ],
  "covered": [
    {"name": "zone", "input": "zone"},
    {"name": "least", "input": "number", "first": 1, "least": 0.01, "most": 1000000, "whole": false},
  ],
  "networked": [
    {"name": "zone", "input": "zone"},
    {"name": "apart_m", "input": "number", "first": 0.35, "least": 0.001, "most": 2000, "whole": false},
    {"name": "radius_m", "input": "number", "first": 0.25, "least": 0.001, "most": 2000, "whole": false},
    {"name": "least", "input": "number", "first": 1, "least": 0.01, "most": 1000000, "whole": false},
  ],
  "all-by": [
    {"name": "goal", "input": "number", "first": 1, "least": 1, "most": 30, "whole": true},
    {"name": "seconds", "input": "number", "first": 1, "least": 0.1, "most": 600, "whole": false},
  ],
  "works": [
    {"name": "share", "input": "number", "first": 0.9, "least": 0.01, "most": 1, "whole": false},
    {"name": "seeds", "input": "number", "first": 100, "least": 10, "most": 200, "whole": true},
  ],
} as const;

export const GROUPS = ["leader", "followers", "all"] as const;

export const TIMES = ["end", "some-moment", "always"] as const;
