"""JSON text within bounds, with places and the spelling of numbers."""
