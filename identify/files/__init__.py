"""Files of logs, as software of many kinds writes them: what they hold, and which of it is what."""
