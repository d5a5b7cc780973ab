// Motorcade: a car that runs programs of 32-bit words, sent to it over the serial line or by infrared from other cars.
#ifndef MOTORCADE_H
#define MOTORCADE_H

#include "MotorcadeArduino.h"
#include "MotorcadeAvr.h"
#include "MotorcadeBoard.h"
#include "MotorcadeCar.h"
#include "MotorcadeSerial.h"
#include "MotorcadeSettings.h"
#include "MotorcadeStore.h"

#endif
