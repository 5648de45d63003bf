"""Between documents and UMRF text: files, edited text, rehearsals. Runs in workers."""
