"""Real hardware behind the contract of a board (`motorcade.car.board`)."""
