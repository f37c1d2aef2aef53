"""Every threshold that a search decides by, and why it is what it is."""

# --- significance ------------------------------------------------------------------------------------------------

# Chance of naming an effect, in one step, where there is nothing to find.
ALPHA = 0.01
# The same where an effect has been added already and what is left looks systematic with no less chance than the
# second of these: then nothing asks for one more.
UNASKED, ASKED = 0.003, 0.05
# Chance of calling a complete model incomplete. It is met at the end of every search, right or wrong, so smaller.
LEFT = 0.002
# An added effect has to lower the held-out loss by this many standard errors of the paired difference, and an effect
# that raises it by less when it is taken out again is idle.
BETTER = 2.0
# Held-out error of a model that might as well predict no loads at all.
NOTHING = 1.0
# A model whose held-out error (the paper's, of all readings alike) is larger by more than this share is no better,
# whatever whitened residuals say: the noise that a stiffer model implies hides more.
RISES = 0.05
# Two effects that are added together were chosen from hundreds of pairs.
TOGETHER = 3.0
# An effect that explains less than this share of what stays unexplained, in held-out χ², stands for a part of that.
LITTLE = 1 / 3

# --- how far to look ---------------------------------------------------------------------------------------------

# Effects added at most: beyond, several together stand for something else.
MOST_EFFECTS = 6
# Candidates that are fitted in full at each step, the most promising ones.
REFITTED = 6
# Rounds in which an effect already in may be exchanged for one that explains more.
EXCHANGES = 3
# Pairs that are fitted in full when no single effect helps, and rounds of growing and exchanging.
PAIRS, REGROWN = 3, 3
# Effects added beyond which no pairs are tried: they stand for something else already.
MOST_AHEAD = 3
# Rounds of whitening and fitting of the first model: which rows have an answer, and their noise, depend on the fit.
WHITENINGS = 3
# Powers of Huber's weights in the reweighted fits of the first model, after which no reading decides what is looked at
# (from the second power on, influence falls with distance).
BOUNDED = (1, 1, 1, 2, 2)

# Where the library ends: guesses at a written effect that are fitted in full, and how many of them may stand at one
# place with the same inputs; how many are fitted again with the noise of the best; written effects at most.
FITTED, ONE_PLACE, RIVALS = 10, 4, 6
# Places and inputs that are told with what each promises.
PLACES_TOLD = 8
MOST_WRITTEN = 2
# Reduction of χ² that a second input has to explain beside what a constant more has to, and the difference in all that
# which tells no form from another.
SECOND_INPUT, UNDECIDED = 10.0, 6.0
# So many effects of the library together may stand for one that it lacks. A written one takes the library's place
# where it explains so much more of χ² for its constants: what explains as much always wins over it.
MANY, CHEAPER = 2, 12.0
# Held-out error, in units of the stated noise, up to which what is written ends the search of the library.
NEAR_NOISE = 2.0

# --- what need not be computed -----------------------------------------------------------------------------------

# An effect this many σ from no effect, by its own standard errors, is not tested for being idle.
CERTAIN = 15.0
# A candidate's fit is given up once χ², less so many times what the linear model still promises, exceeds so many times
# that of the model which it would have to match. Both generous: near the noise no fit is ever given up.
TRUST, BEHIND = 10.0, 2.0

# --- what is alike -----------------------------------------------------------------------------------------------

# Difference in χ² that speaks for neither of two models: two standard deviations of one whitened number.
COINCIDE = 4.0
# A stand-in must promise, to first order, at least this share of what the effect itself promises.
COMPARABLE = 0.25
# Mean gain per kinematic state, in χ², for which an effect is exchanged.
WORTH_EXCHANGING = 0.5

# Share of the clock's variance that an input explains where the states were measured in its order.
SORTED = 0.8
# Reduction of χ² that a block of slipped readings has to explain: there are hundreds of places for one.
BLOCK = 30.0
# Increase of χ² up to which an effect is idle beside blocks: three standard deviations of one whitened number.
IDLE = 9.0

# --- whitened fits -----------------------------------------------------------------------------------------------

# A fit that stopped early stands at a minimum if the linear model promises no more than this reduction of χ², in units
# of χ² per number (at least of the stated noise): a difference of a tenth decides nothing.
PROMISE = 0.1
