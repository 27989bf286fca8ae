"""What the commands do, by the names of the files of their options."""
