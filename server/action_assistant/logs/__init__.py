"""What the processes write about what they do: as lines for people, or as JSON for programs."""
