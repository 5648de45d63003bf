"""Updates of documents: what they consist of, and what of that neither a room nor a page could bear."""
