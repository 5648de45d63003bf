"""Copies of journals: into another database, before their tables change, and what is known of backups."""
