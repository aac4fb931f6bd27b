use super::*;
use std::sync::Arc;
pub(super) struct ParquetLog;
impl ParquetLog {
    pub(super) fn open(_b: Arc<dyn Bytes>) -> Result<Self, LogError> {
        Err(LogError::Empty)
    }
}
impl Log for ParquetLog {
    fn groups(&self) -> &[Group] {
        &[]
    }
    fn choose(&mut self, _: &[(usize, usize)]) -> Result<(), LogError> {
        Ok(())
    }
    fn next(&mut self, _: &mut Block) -> Result<bool, LogError> {
        Ok(false)
    }
    fn notes(&self) -> Vec<String> {
        vec![]
    }
}
