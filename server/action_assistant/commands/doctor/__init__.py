"""`doctor`: what is wrong with an installation, with the place, the reason and the remedy."""
