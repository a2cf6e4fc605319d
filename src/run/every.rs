//! How often a run writes something: by steps or by time.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
use std::fmt;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// How often something is due.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Every {
    /// Every this many steps; 0 for never.
    Steps(u32),
    /// Every this many minutes (above 0), at the end of a step.
    Minutes(f64),
}

impl Every {
    /// Never.
    pub const NEVER: Self = Self::Steps(0);

    /// Returns true if it is due after `step`, given the step and time of the last occurrence.
    pub(super) fn is_due(self, step: u32, since: Instant) -> bool {
        match self {
            Self::Steps(every) => every > 0 && step.is_multiple_of(every),
            Self::Minutes(minutes) => since.elapsed() >= Duration::from_secs_f64(60.0 * minutes),
        }
    }
}

impl FromStr for Every {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`{text}` is not a number of steps or minutes; expected for example 1000, 10min, or 0 for never")
        };
        let Some(minutes) = text.trim().strip_suffix("min") else {
            return text.trim().parse().map(Self::Steps).map_err(|_| wrong());
        };
        // A hundred years fit into a `Duration`.
        let minutes = minutes.trim().parse().ok().filter(|minutes| *minutes > 0.0 && *minutes < 5e7);
        minutes.map(Self::Minutes).ok_or_else(wrong)
    }
}

impl fmt::Display for Every {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Steps(steps) => write!(formatter, "{steps}"),
            Self::Minutes(minutes) => write!(formatter, "{minutes}min"),
        }
    }
}

impl Serialize for Every {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Steps(steps) => to.serialize_u32(*steps),
            Self::Minutes(_) => to.collect_str(self),
        }
    }
}

impl<'a> Deserialize<'a> for Every {
    fn deserialize<D: Deserializer<'a>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Value {
            Steps(u32),
            Text(String),
        }
        match Value::deserialize(from)? {
            Value::Steps(steps) => Ok(Self::Steps(steps)),
            Value::Text(text) => text.parse().map_err(D::Error::custom),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Every;
    use std::time::{Duration, Instant};

    #[test]
    fn steps_and_minutes_are_told_apart() {
        for (text, every) in [
            ("0", Every::NEVER),
            ("250", Every::Steps(250)),
            ("10min", Every::Minutes(10.0)),
            (" 1.5 min", Every::Minutes(1.5)),
        ] {
            assert_eq!(text.parse(), Ok(every));
            assert_eq!(every.to_string().parse(), Ok(every));
        }
        for text in ["", "min", "0min", "-1min", "NaNmin", "1e9min", "10 s", "1.5", "-3"] {
            assert!(text.parse::<Every>().is_err_and(|said| said.contains("10min")), "{text}");
        }
    }

    #[test]
    fn time_counts_from_the_last_one() {
        let now = Instant::now();
        let before = now.checked_sub(Duration::from_secs(90)).expect("the machine runs for longer");
        assert!(Every::Minutes(1.0).is_due(7, before) && !Every::Minutes(2.0).is_due(7, before));
        assert!(Every::Steps(7).is_due(14, now) && !Every::Steps(7).is_due(13, now) && !Every::NEVER.is_due(14, now));
    }
}
