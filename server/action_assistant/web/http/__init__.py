"""HTTP without regard to who asks: problem details, cookies, the built page."""
