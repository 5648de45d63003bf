"""`service`: this program as a service of systemd, of a user or of the computer."""
