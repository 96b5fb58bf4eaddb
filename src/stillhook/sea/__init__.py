"""The sea as the crane feels it: motions of the crane tip, and of the ship that carries it."""
