"""How a contact is solved: time stepping, equilibrium, instabilities, hereditary memory."""
