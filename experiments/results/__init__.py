"""What experiments leave on disk: files that are written whole, folders of results, and views that may fail alone."""
