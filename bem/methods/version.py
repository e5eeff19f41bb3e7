"""Which solver computed a number.

A change of the code that moves results raises `SOLVER_VERSION`; one that does not leaves it. Trajectories kept in
`tests/bem/methods/golden_trajectories.json` guard it: their test fails when results move, and `make
golden-trajectories` renews them once the version was raised. Campaigns, and studies that keep what they computed, are
known by it.

Versions: 1, up to the data set published first (known there by a digest of the source); 2, only stable states, forces
as exact as the step control needs, loops of elastic contacts by their energy; 3, iterations that start from a cubic
and are accelerated; 4, a smooth traction between the nodes, and fewer of them; 5, stability judged anew after a step
that was shortened; 6, elastic contacts of Tabor parameters from 4.5 on follow the curve of their equilibria always;
7, all elastic contacts with adhesion do, and contacts without adhesion are answered by closed forms; 8, a finer mesh
for edges that creep through dwells of more than ten retardation times, no short step after other nodes are chosen in
stiff solids, and time steps for elastic contacts of flat tips under steep laws; 9, viscoelastic contacts without
adhesion behind a spring or under a force leave a step early that is known to be rejected; 10, shorter steps along the
curve of equilibria where its force bends, before a fast reload, and for a load that grows from zero without adhesion;
time steps for more flat tips under steep laws; 11, shorter steps where the surfaces of a stiff elastic contact meet,
contacts without adhesion behind soft springs that end in no NaN, and bounds of physics that every completed
trajectory keeps; 12, sharp cracks whose edge is sought by lines through two values, and half as many steps and nodes of
them in drafts. The paper's box has none of 8 to 12.
"""

SOLVER_VERSION = "12"
