"""Starts: requests, their checks, approvals, and what is stored of them."""
