"""Runtime of the controller: executive, controllers, identification; knows no bus."""
