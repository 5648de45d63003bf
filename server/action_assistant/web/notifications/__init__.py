"""Notifications: messages for people elsewhere, by webhook or mail, out of one outbox."""
