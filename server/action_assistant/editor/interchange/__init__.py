"""Between documents and UMRF text: files, edited text, rehearsals. For workers."""
