// The pins of your car: write your board's numbers instead of NO_PIN, for the parts that it has. A motor has
// forward, backward, enable, or enable and direction; floor has left, right. MotorcadeSettings.h explains
// the rest. Leave alone the pins that the board itself needs, for its flash memory or its USB line: its
// manual names them.
#ifndef MOTORCADE_CAR_SETTINGS
#define MOTORCADE_CAR_SETTINGS

#include <MotorcadeSettings.h>

using motorcade::NO_PIN;

static const uint32_t LEVELS[] = {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100, 560, 5, 250, 6, 110, 3520, 2, 10000};

extern const motorcade::CarSettings CAR;
constexpr motorcade::CarSettings CAR = {
    LEVELS,  // levels
    115200,  // baud
    2000,  // range_mm
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // left_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // right_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // left_rear_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // right_rear_motor
    NO_PIN,  // standby
    {0, 85, 170, 255},  // drive_duties
    {0, 85, 170, 255},  // turn_duties
    100,  // left_duty_percent
    100,  // right_duty_percent
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN},  // leds
    NO_PIN,  // pixels
    1,  // pixel_count
    NO_PIN,  // trigger
    NO_PIN,  // echo
    {NO_PIN},  // pir
    {NO_PIN, NO_PIN},  // floor
    1,  // floor_dark
    0,  // floor_threshold
    NO_PIN,  // button
    0,  // button_pressed
    0,  // button_threshold
    NO_PIN,  // infrared_receiver
    NO_PIN,  // infrared_sender
    NO_PIN,  // horn
    NO_PIN,  // voice
    0,  // voice_baud
    nullptr,  // voice_patterns
    0,  // voice_pattern_count
};

#endif
