"""Every threshold that a search decides by, and why it is what it is."""

# --- what may be claimed -----------------------------------------------------------------------------------------

# Difference in the logarithm of the evidence up to which one set is as good as another: odds of 20 to 1.
TIES = 3.0
# The same within which a set that fits and predicts no worse is asked where the referee does not let the one shown
# stand: what he finds is by chance once in a million, which outweighs odds of 3,000 to 1.
OUTWEIGHED = 8.0
# Probability that an effect, or what stands in for it, must have to be part of an answer.
SURE = 0.95
# Probability that nothing is missing below which a model is not called adequate.
EVEN = 0.5
# Effects that one of a class may be: of more the table cannot tell, unless another place is told.
MOST_ALIKE = 4
# Share of what a written effect explains that the library's may leave of it: forms of one thing differ by as much.
FORMS = 0.03
# Sets that are kept as such that are as good, at most, and that are told with their errors.
TOLD, MODELS_TOLD = 20, 8
# A candidate stands out in the ranking if noise would promise as much with this chance, of all that were tried.
CLEAR = 0.01
# Chance of calling a complete model incomplete. It is met at the end of every search, right or wrong, so small.
ALPHA_STRUCTURE = 0.002
# An effect has to lower the held-out loss by this many standard errors of the paired difference to stay in a model that
# is unexplained, and a set that raises it by as many is not as good as another.
MIN_PAIRED_Z = 2.0
# Held-out error of a model that might as well predict no loads at all.
NOTHING = 1.0
# A model whose held-out error (the paper's, of all readings alike) is larger by more than this share is no better,
# whatever whitened residuals say, where states that differ by chance alone would say so at most so often.
RISES, RISEN = 0.05, 0.95
# An effect that explains less than this share of what stays unexplained, in held-out χ², stands for a part of that.
MIN_SHARE = 1 / 3
# Share of the error that two effects which help only together may leave, to stay in a model that is unexplained.
TOGETHER = 0.5
# Effects that an unexplained model keeps at most: beyond, several together stand for something else.
MOST_KEPT = 2

# --- how far to look ---------------------------------------------------------------------------------------------

# Effects of a set at most.
MOST_EFFECTS = 6
# The most probable sets whose neighbors are looked at; how many neighbors with an effect more are fitted, and with two.
BEAM, CHILDREN, PAIRS = 3, 6, 3
# Sets whose neighbors are looked at, at most, under one noise; and where only a glance is asked: those of the best set,
# what could stand in for its effects, and the neighbors of what is best then.
MOST_EXPANDED, GLANCE = 12, 3
# Sets whose neighbors are looked at under the noise alone, before any doubt, and effects of an answer that so few
# states give then.
AT_ONCE, FEW_STATES = 2, 16
# Rise of the evidence, to first order, below which a neighbor is not fitted: what is linear may promise too little.
HOPEFUL = -3.0
# Difference in evidence beyond which a set is not looked at again where the noise changes a little.
HOPELESS = 15.0
# Fall of the evidence, to first order, beyond which a set without an effect is not fitted. What is linear may promise
# ten times what is lost, hardly more; it would still be hopeless.
NEEDED = 100.0
# What stands in for an effect must promise, to first order, no less than the effect itself but for this, or for
# twice as much as that is wrong about the effect; of what is large no less than this share of it, which two forms may
# differ by.
COMPARABLE, ALMOST = 6.0, 0.95
# Sets that are as good, of which is asked what could stand in for what they share.
RIVALS = 5
# Sets that are fitted again where the noise changes.
REFITTED = 16
# Rounds of whitening and fitting of the first model: which rows have an answer, and their noise, depend on the fit.
# Rounds of estimating the scatter about the best model.
WHITENINGS, SETTLINGS = 3, 3
# A scale of the scatter that changes by less than this share decides nothing.
STEADY = 0.1
# Powers of Huber's weights in the reweighted fits of the first model, after which no reading decides what is looked at
# (from the second power on, influence falls with distance).
BOUNDED = (1, 1, 1, 2, 2)
# With more rows than this sets are looked at on so many of them first.
SCOUTED = 800
# A model counts as wrong by so much of what the best one leaves beside the noise, in every reading; that is no less
# than a share of all that it leaves.
WRONG_BY, LEAST_WRONG = 0.5, 0.25
# χ² per reading under the noise alone up to which the best set may be right: it was fitted under more doubt.
HARDLY = 10.0
# The most probable sets that are fitted under the noise alone before the others are, and times INADEQUATE that they may
# leave: what is farther off no effect more makes right.
FORERUNNERS, FAR = 4, 2.0
# Times what the best set left under more doubt that it may leave under less.
WORSE = 1.5
# Times that the amount is made smaller, at most; share of it that a better model must be wrong by at most for it to be
# made so at the end.
MOST_LOWERED, SETTLED = 8, 0.9
# Share of what the library leaves of χ² that sets with a written effect may leave, at a glance, to be looked at
# further: of an answer that does not hold they are a hint at best, and one that holds leaves far less.
MENDED = 0.6
# The same of what shows systematically, where the noise has grown by all that the library leaves: 0.67 at most where a
# form was one of two things in a table (six of 13 simulated ones), 0.97 on a measured muscle, which no form explains.
LESS_LEFT = 0.8
# χ² per reading beyond which a model cannot be right under the noise as it is.
INADEQUATE = 2.5
# Times what was found to scatter that a set which leaves nothing systematic may leave before that is the noise: with
# several rows a state it is 0.97 to 1.01, with one 1.0 to 1.3.
CONSISTENT = 1.05

# Where the library ends: guesses at a written effect that join the candidates, and how many of them may stand at one
# place with the same inputs.
FITTED, ONE_PLACE = 10, 4
# Places and inputs that are told with what each promises.
PLACES_TOLD = 8
# Odds of a form that was chosen from thousands: about one in ten thousand of the library's own.
WRITTEN_ODDS = 4e-6
# Times that the search writes: beside what it wrote something else may be left. Times what the noise makes, as it was
# found, that the held-out error may be for it to write again: a model that is farther off is not one form away.
WRITTEN_ROUNDS, NEARLY = 2, 2.0
# Reduction of χ² that a second input has to explain beside what a constant more has to.
SECOND_INPUT = 10.0
# So many effects of the library together may stand for one that it lacks. Of fewer, but several, this is asked where
# one form of one input promises, to first order, what one of them explains and so much of what the other adds. Where
# one form was hidden it promised 1.01 to 1.2 times what both explain (five simulated tables).
MANY, SEVERAL, ALIKE = 3, 2, 0.9

# --- what is alike -----------------------------------------------------------------------------------------------

# Difference in χ² that speaks for neither of two models: two standard deviations of one whitened number.
COINCIDE = 4.0
# What rows of one set pressure differ by is the gauge's own where it is told by so many of its standard errors.
GAUGES_OWN = 4.0
# Share of the clock's variance that an input explains where the states were measured in its order.
SORTED = 0.8
# Reduction of χ² that a block of slipped readings has to explain: there are hundreds of places for one.
BLOCK = 30.0
# Increase of χ² up to which an effect is idle beside blocks: three standard deviations of one whitened number.
IDLE = 9.0
# By how much χ² has to fall, in the linear model, for first rows under pressure to count as reached by rising pressure:
# three standard deviations of one whitened number.
REACHED = 9.0

# --- whitened fits -----------------------------------------------------------------------------------------------

# A fit that stopped early stands at a minimum if the linear model promises no more than this reduction of χ², in units
# of χ² per number (at least of the stated noise): odds of less than two to one.
PROMISE = 1.0
