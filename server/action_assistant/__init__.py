"""TeMoto Action Assistant: design, run and review robot tasks together."""
