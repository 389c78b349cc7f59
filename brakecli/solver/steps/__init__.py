"""The paper's difference schemes: steps of one length, each a minimisation in closed form, and their one loop."""
