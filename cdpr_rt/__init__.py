"""Runtime of the controller: control loop, controllers, identification; knows no bus."""
