"""The recorded facts of one grading, and their JSON. Facts only: the checks judge them.

On disk the evidence of a grading is one folder:

    submission.json     Intake: what was handed in, which package was chosen
    build.json          Build: how the build went and what it installed
    tests.json          StudentTests: the package's own tests and their coverage
    mutation.json       Mutation: mutants of the package, and which of its tests noticed each
    quality.json        Quality: facts about the package's text, which is read and never run
    trials/NAME.json    Trial: one run of one node in a world
    flags.json          list of Flag: attempts at tampering and other things to look at
    functions.json      list of FunctionAnswer: what the package's functions returned
    hunts.json          Hunt by requirement: what made-up cases have shown; absent if there was no hunt
    kept.json           what an earlier grading of the same content collected, and when; absent if nothing
    origin.json         seed, versions and hashes: all that is needed to run the same grading again

Times `t` are simulated seconds since the trial began, unless a name says wall.
"""

from grader.evidence.model import (
    BrokenPromise,
    Build,
    EquivalentMutant,
    Evidence,
    FileCoverage,
    Flag,
    FunctionAnswer,
    Hunt,
    Intake,
    Mutant,
    Mutation,
    StudentTests,
    TestModule,
    short_name,
)
from grader.evidence.quality import (
    CodeInterface,
    Copy,
    Definition,
    Fault,
    Finding,
    FunctionUse,
    Manifest,
    ParameterUse,
    Quality,
    Readme,
    SourceFile,
    Table,
    TestReport,
)
from grader.evidence.reasons import Kind, Reason
from grader.evidence.store import digest, from_data, from_json, load, save, to_data, to_json
from grader.evidence.trial import (
    Call,
    Command,
    Endpoint,
    Goal,
    Graph,
    Message,
    ParameterAnswer,
    ProcessEnd,
    Ran,
    Sample,
    ScanSummary,
    Touch,
    Trial,
)
