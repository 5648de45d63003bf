"""Looking back on runs: replay, comparison, sums, marks of people, files to hand over."""
