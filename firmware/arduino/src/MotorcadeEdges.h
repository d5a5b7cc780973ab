// Interrupts at the edges of pins: those of the infrared receiver, of the echo, and of a voice module without a UART.
//
// On an Uno or Nano each pin has one, by the chip's pin-change interrupts; on other boards those that the core's
// attachInterrupt knows.
#ifndef MOTORCADE_EDGES_H
#define MOTORCADE_EDGES_H

#include <stdint.h>

#include "MotorcadeInfrared.h"
#include "MotorcadeParts.h"

namespace motorcade {

// Let an interrupt take each edge at `pin` from now on; once for each of them.
void watch_receiver(uint8_t pin, InfraredReceiver &receiver);
void watch_echo(uint8_t pin, EchoTimer &timer);
// On an Uno or Nano alone.
void watch_voice(uint8_t pin, EdgeSerial &line);

}  // namespace motorcade

#endif
