#pragma once

/// The kinds of nodes: a line for each, and a file of its own in `nodes` (the name in snake_case), from whose
/// struct follow how it is ticked, what it remembers and which values a saved state may hold there, its entries in the
/// palette, and what `sentree check` concludes about it. Saved trees have kinds by their place here: new ones come
/// last.
#define SENTREE_BT_NODES(node)                                                                                    \
  node(Sequence) node(Fallback) node(AsyncSequence) node(AsyncFallback) node(SequenceWithMemory)                  \
      node(ReactiveSequence) node(ReactiveFallback) node(Parallel) node(ParallelAll) node(IfThenElse)             \
          node(WhileDoElse) node(Switch) node(TryCatch) node(ManualSelector) node(Inverter) node(ForceSuccess)    \
              node(ForceFailure) node(Repeat) node(Retry) node(KeepRunningUntilFailure) node(Delay) node(Timeout) \
                  node(RunOnce) node(Precondition) node(SkipUnlessUpdated) node(WaitValueUpdate) node(Loop)       \
                      node(BlackboardCheck) node(SubTree) node(AlwaysSuccess) node(AlwaysFailure) node(Script)    \
                          node(ScriptCondition) node(SetBlackboard) node(UnsetBlackboard) node(Sleep)             \
                              node(WasEntryUpdated) node(TestNode) node(ExternalAction) node(ExternalCondition)   \
                                  node(User) node(Unknown)
