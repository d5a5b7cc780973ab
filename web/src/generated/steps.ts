/** The kinds of steps, and the fields of both kinds of words. Written by scripts/generate.py; don't edit. */

export const STEP_KINDS = [
  {
    "kind": "drive",
    "category": "drive",
    "icon": "M4 15v-3l3-5h8l4 5h1v3zM7 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4ZM17 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z",
    "in_start": true,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "choice",
        "name": "DIRECTION",
        "word": "motor_direction",
        "options": [
          "forward",
          "left",
          "right",
          "random"
        ],
        "least": 0
      },
      {
        "input": "level",
        "name": "SPEED",
        "word": "motor_speed",
        "menu": "speed",
        "levels": [
          0,
          1,
          2,
          3
        ],
        "first": 2
      },
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "motor_duration"
      }
    ],
    "group": "motor",
    "hue": 219,
    "sets": {
      "motor_enable": 1
    }
  },
  {
    "kind": "wait",
    "category": "drive",
    "icon": "M7 3h10M7 21h10M8 3c0 5 8 5 8 9s-8 4-8 9M16 3c0 5-8 5-8 9s8 4 8 9",
    "in_start": true,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "motor_duration"
      }
    ],
    "group": "motor",
    "hue": 219,
    "sets": {
      "motor_enable": 1,
      "motor_direction": 0,
      "motor_speed": 0
    }
  },
  {
    "kind": "led",
    "category": "light",
    "icon": "M9 18h6M10 21h4M12 3a6 6 0 0 0-3.500 10.900V16h7v-2.100A6 6 0 0 0 12 3Z",
    "in_start": true,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "level",
        "name": "WHICH",
        "word": "led_which",
        "menu": "light",
        "levels": [
          0,
          1,
          2,
          3
        ],
        "first": 0
      },
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "led_duration"
      }
    ],
    "group": "led",
    "hue": 41,
    "sets": {}
  },
  {
    "kind": "avoid",
    "category": "sense",
    "icon": "M12 3l8 3v6c0 5-4 8-8 9-4-1-8-4-8-9V6zM9 9l6 6M15 9l-6 6",
    "in_start": false,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "level",
        "name": "RADIUS",
        "word": "avoid_radius",
        "menu": "radius",
        "levels": [
          0,
          1,
          2,
          3
        ],
        "first": 0
      },
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "avoid_duration"
      }
    ],
    "group": "avoid",
    "hue": 166,
    "sets": {
      "avoid_enable": 1
    }
  },
  {
    "kind": "voice",
    "category": "sense",
    "icon": "M12 3a3 3 0 0 0-3 3v6a3 3 0 0 0 6 0V6a3 3 0 0 0-3-3ZM6 11a6 6 0 0 0 12 0M12 17v4M9 21h6",
    "in_start": true,
    "accompanies": true,
    "holds": false,
    "fields": [
      {
        "input": "seconds",
        "name": "SECONDS"
      }
    ],
    "group": "voice",
    "hue": 263,
    "sets": {
      "voice": 1
    }
  },
  {
    "kind": "pir",
    "category": "sense",
    "icon": "M12 4a3 3 0 1 0 0 6 3 3 0 0 0 0-6ZM5.500 20a6.500 6.500 0 0 1 13 0",
    "in_start": false,
    "accompanies": true,
    "holds": false,
    "fields": [
      {
        "input": "seconds",
        "name": "SECONDS"
      }
    ],
    "group": "pir",
    "hue": 22,
    "sets": {
      "pir": 1
    }
  },
  {
    "kind": "follow_line",
    "category": "sense",
    "icon": "M5 21c0-7 14-7 14-13V3M9 3h10M9 21H1",
    "in_start": false,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "level",
        "name": "SPEED",
        "word": "motor_speed",
        "menu": "speed",
        "levels": [
          1,
          2,
          3
        ],
        "first": 2
      },
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "motor_duration"
      }
    ],
    "group": "motor",
    "hue": 95,
    "sets": {
      "motor_enable": 1,
      "motor_direction": 0,
      "floor": 1
    }
  },
  {
    "kind": "turn_to_line",
    "category": "sense",
    "icon": "M6 21V9a5 5 0 0 1 10 0v2M12 8l4 4 4-4M3 21h18",
    "in_start": false,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "choice",
        "name": "DIRECTION",
        "word": "motor_direction",
        "options": [
          "left",
          "right"
        ],
        "least": 1
      },
      {
        "input": "level",
        "name": "SPEED",
        "word": "motor_speed",
        "menu": "speed",
        "levels": [
          1,
          2,
          3
        ],
        "first": 2
      },
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "motor_duration"
      }
    ],
    "group": "motor",
    "hue": 95,
    "sets": {
      "motor_enable": 1,
      "floor": 1
    }
  },
  {
    "kind": "stop_on_dark",
    "category": "sense",
    "icon": "M4 8h10l6 4-6 4H4zM12 21a9 3 0 0 1 0-6",
    "in_start": false,
    "accompanies": false,
    "holds": false,
    "fields": [
      {
        "input": "level",
        "name": "SPEED",
        "word": "motor_speed",
        "menu": "speed",
        "levels": [
          1,
          2,
          3
        ],
        "first": 2
      },
      {
        "input": "seconds",
        "name": "SECONDS",
        "word": "motor_duration"
      }
    ],
    "group": "motor",
    "hue": 95,
    "sets": {
      "motor_enable": 1,
      "motor_direction": 3,
      "floor": 1
    }
  },
  {
    "kind": "floor",
    "category": "sense",
    "icon": "M4 20h16M8 4v9M16 4v9M6 13h4M14 13h4",
    "in_start": false,
    "accompanies": true,
    "holds": false,
    "fields": [
      {
        "input": "seconds",
        "name": "SECONDS"
      }
    ],
    "group": "floor",
    "hue": 95,
    "sets": {
      "floor": 1
    }
  },
  {
    "kind": "repeat",
    "category": "order",
    "icon": "M4 11a7 7 0 0 1 12-4.500L19 9M19 4v5h-5M20 13a7 7 0 0 1-12 4.500L5 15M5 20v-5h5",
    "in_start": true,
    "accompanies": false,
    "holds": true,
    "fields": [
      {
        "input": "number",
        "name": "TIMES",
        "minimum": 1,
        "first": 2
      }
    ]
  },
  {
    "kind": "together",
    "category": "order",
    "icon": "M4 6h16M4 12h16M4 18h16M8 3v18",
    "in_start": true,
    "accompanies": false,
    "holds": true,
    "fields": []
  }
] as const;

export const CATEGORIES = [
  "drive",
  "light",
  "sense",
  "order"
] as const;

export const HAT_IN_START = [
  "FORWARD"
] as const;

export const FORMATS = {
  "header": [
    {
      "name": "leader_states",
      "high": 31,
      "low": 24
    },
    {
      "name": "follower_words",
      "high": 23,
      "low": 16
    },
    {
      "name": "dwell",
      "high": 15,
      "low": 8
    },
    {
      "name": "reserved",
      "high": 7,
      "low": 0
    }
  ],
  "control": [
    {
      "name": "accept_ir",
      "high": 31,
      "low": 31
    },
    {
      "name": "forward",
      "high": 30,
      "low": 30
    },
    {
      "name": "motor_enable",
      "high": 29,
      "low": 29
    },
    {
      "name": "motor_direction",
      "high": 28,
      "low": 27
    },
    {
      "name": "motor_speed",
      "high": 26,
      "low": 25
    },
    {
      "name": "motor_duration",
      "high": 24,
      "low": 23
    },
    {
      "name": "led_which",
      "high": 22,
      "low": 21
    },
    {
      "name": "led_duration",
      "high": 20,
      "low": 19
    },
    {
      "name": "avoid_enable",
      "high": 18,
      "low": 18
    },
    {
      "name": "avoid_radius",
      "high": 17,
      "low": 16
    },
    {
      "name": "avoid_duration",
      "high": 15,
      "low": 14
    },
    {
      "name": "voice",
      "high": 13,
      "low": 13
    },
    {
      "name": "pir",
      "high": 12,
      "low": 12
    },
    {
      "name": "floor",
      "high": 11,
      "low": 11
    },
    {
      "name": "reserved",
      "high": 10,
      "low": 1
    },
    {
      "name": "parity",
      "high": 0,
      "low": 0
    }
  ]
} as const;

export const WORD_FIELDS = {
  "motor_enable": {
    "group": "motor",
    "meaning": "flag"
  },
  "motor_direction": {
    "group": "motor",
    "meaning": "choice",
    "options": [
      "forward",
      "left",
      "right",
      "random"
    ]
  },
  "motor_speed": {
    "group": "motor",
    "meaning": "level",
    "menu": "speed"
  },
  "motor_duration": {
    "group": "motor",
    "meaning": "duration"
  },
  "led_which": {
    "group": "led",
    "meaning": "level",
    "menu": "light"
  },
  "led_duration": {
    "group": "led",
    "meaning": "duration"
  },
  "avoid_enable": {
    "group": "avoid",
    "meaning": "flag"
  },
  "avoid_radius": {
    "group": "avoid",
    "meaning": "level",
    "menu": "radius"
  },
  "avoid_duration": {
    "group": "avoid",
    "meaning": "duration"
  },
  "voice": {
    "group": "voice",
    "meaning": "flag"
  },
  "pir": {
    "group": "pir",
    "meaning": "flag"
  },
  "floor": {
    "group": "floor",
    "meaning": "flag"
  }
} as const;

export const HUES = {
  "motor": 95,
  "led": 41,
  "avoid": 166,
  "voice": 263,
  "pir": 22,
  "floor": 95
} as const;

export const PYTHON_CALLS = [
  {
    "name": "forward",
    "kind": "drive",
    "signature": "forward(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 0,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "forward(1, speed=3)"
  },
  {
    "name": "left",
    "kind": "drive",
    "signature": "left(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 0,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "left(1, speed=3)"
  },
  {
    "name": "right",
    "kind": "drive",
    "signature": "right(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 0,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "right(1, speed=3)"
  },
  {
    "name": "wander",
    "kind": "drive",
    "signature": "wander(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 0,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "wander(1, speed=3)"
  },
  {
    "name": "wait",
    "kind": "wait",
    "signature": "wait(seconds)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      }
    ],
    "example": "wait(1)"
  },
  {
    "name": "led",
    "kind": "led",
    "signature": "led(which, seconds)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "which",
        "least": 0,
        "most": 3,
        "menu": "light"
      },
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      }
    ],
    "example": "led(0, 1)"
  },
  {
    "name": "avoid",
    "kind": "avoid",
    "signature": "avoid(radius, seconds)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "radius",
        "least": 0,
        "most": 3,
        "menu": "radius"
      },
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      }
    ],
    "example": "avoid(0, 1)"
  },
  {
    "name": "voice",
    "kind": "voice",
    "signature": "voice(seconds=None)",
    "holds": false,
    "accompanies": true,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400,
        "default": null
      }
    ],
    "example": "voice()"
  },
  {
    "name": "pir",
    "kind": "pir",
    "signature": "pir(seconds=None)",
    "holds": false,
    "accompanies": true,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400,
        "default": null
      }
    ],
    "example": "pir()"
  },
  {
    "name": "follow_line",
    "kind": "follow_line",
    "signature": "follow_line(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 1,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "follow_line(1, speed=3)"
  },
  {
    "name": "turn_left_to_line",
    "kind": "turn_to_line",
    "signature": "turn_left_to_line(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 1,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "turn_left_to_line(1, speed=3)"
  },
  {
    "name": "turn_right_to_line",
    "kind": "turn_to_line",
    "signature": "turn_right_to_line(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 1,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "turn_right_to_line(1, speed=3)"
  },
  {
    "name": "stop_on_dark",
    "kind": "stop_on_dark",
    "signature": "stop_on_dark(seconds, speed=2)",
    "holds": false,
    "accompanies": false,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400
      },
      {
        "name": "speed",
        "least": 1,
        "most": 3,
        "default": 2,
        "menu": "speed"
      }
    ],
    "example": "stop_on_dark(1, speed=3)"
  },
  {
    "name": "floor",
    "kind": "floor",
    "signature": "floor(seconds=None)",
    "holds": false,
    "accompanies": true,
    "parameters": [
      {
        "name": "seconds",
        "least": 0,
        "most": 86400,
        "default": null
      }
    ],
    "example": "floor()"
  },
  {
    "name": "repeat",
    "kind": "repeat",
    "signature": "repeat(times, step, step, \u2026)",
    "holds": true,
    "accompanies": false,
    "parameters": [
      {
        "name": "times",
        "least": 1,
        "most": 1000000000
      }
    ],
    "example": "repeat(2, forward(1), led(0, 1))"
  },
  {
    "name": "together",
    "kind": "together",
    "signature": "together(step, step, \u2026)",
    "holds": true,
    "accompanies": false,
    "parameters": [],
    "example": "together(forward(1), led(0, 1))"
  }
] as const;

export const PYTHON_SETTINGS = [
  "accept_ir",
  "forward"
] as const;
