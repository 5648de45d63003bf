"""JSON text: within bounds, with the spelling of its numbers, and with places."""
