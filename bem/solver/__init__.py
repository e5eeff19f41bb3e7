"""How a contact is solved: mesh, equilibrium, instabilities, hereditary memory, time stepping."""
