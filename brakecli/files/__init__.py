"""Result files and the signals of the operating system: what a user gets, whole or not at all."""
