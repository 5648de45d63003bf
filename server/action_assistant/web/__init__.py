"""Parts that both HTTP applications share: access control, and the form of refusals."""
