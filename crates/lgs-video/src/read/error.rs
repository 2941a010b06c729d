//! Why a video's frames cannot be read.

/// Why a video's frames cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The file is of another kind.
    #[error("the file is no MP4 or MOV")]
    Container,
    /// The file has sound alone, say.
    #[error("the file has no video track")]
    NoVideo,
    /// The video has another codec.
    #[error("the video is coded as `{found}`")]
    Codec {
        /// Name of the codec in the file, such as `hvc1`.
        found: String,
    },
    /// H.264 of a kind that the decoder lacks.
    #[error("the video's H.264 has {0}")]
    Unsupported(String),
    /// The index of the file is missing or wrong.
    #[error("the video's index {0}")]
    Index(String),
    /// The frames end before those that the index lists.
    #[error("the video ends early: of {expected} frames {decoded} could be decoded; {reason}")]
    EndsEarly {
        /// Frames that the index lists.
        expected: usize,
        /// Frames before the defect.
        decoded: usize,
        /// What ended them.
        reason: String,
    },
    /// The file cannot be read.
    #[error("the video cannot be read: {0}")]
    File(#[from] std::io::Error),
}

impl DecodeError {
    /// Whether the video may be sound, so that another decoder can be asked.
    #[must_use]
    pub fn is_of_another_kind(&self) -> bool {
        matches!(self, Self::Container | Self::NoVideo | Self::Codec { .. } | Self::Unsupported(_))
    }
}

/// An index with a defect.
pub(super) fn index(defect: impl Into<String>) -> DecodeError {
    DecodeError::Index(defect.into())
}
