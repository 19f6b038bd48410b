//! How a row ended.

/// The outcome of one row; a failing row is data, with a remedy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Reached the end of the scenario.
    Finished,
    /// Needed more steps than allowed.
    MaxSteps,
    /// The step size fell below the resolution of time.
    StepTooSmall,
    /// The state or its rate stopped being a finite number.
    NotFinite,
    /// A terminal event ended the row early; reserved, as no event does so yet.
    StoppedByEvent,
    /// A parameter makes the row meaningless.
    BadParameters,
    /// The sweep was interrupted before the row was done.
    Cancelled,
    /// A defect of the engine; the other rows are unaffected.
    Internal,
}

impl Status {
    /// All outcomes in the order of their codes.
    pub const ALL: [Self; 8] = [
        Self::Finished,
        Self::MaxSteps,
        Self::StepTooSmall,
        Self::NotFinite,
        Self::StoppedByEvent,
        Self::BadParameters,
        Self::Cancelled,
        Self::Internal,
    ];

    /// The name users see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::MaxSteps => "max_steps",
            Self::StepTooSmall => "step_too_small",
            Self::NotFinite => "not_finite",
            Self::StoppedByEvent => "stopped_by_event",
            Self::BadParameters => "bad_parameters",
            Self::Cancelled => "cancelled",
            Self::Internal => "internal",
        }
    }

    /// What the user can do about it.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Finished => "Nothing to do.",
            Self::MaxSteps => {
                "Raise max_steps, loosen rtol, or shorten t_end; a row that needs far more steps than its neighbours is stiff, which method=\"rodas5p\" cures, or has too small a max_step."
            }
            Self::StepTooSmall => {
                "Loosen rtol, or look for inputs or parameters that change faster than the clock can resolve."
            }
            Self::NotFinite => {
                "The motion blew up: check inertias, stiffness and torques of this row for values far outside the plausible ranges."
            }
            Self::StoppedByEvent => "Reserved: no event ends a row yet.",
            Self::BadParameters => "Correct the named parameter of this row.",
            Self::Cancelled => "Run the row again; the sweep was interrupted before it was done.",
            Self::Internal => "Please report this row with its parameters; all other rows are valid.",
        }
    }
}
