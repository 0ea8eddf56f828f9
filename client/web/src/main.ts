import { Workbench } from './app';
import { applyTheme } from './ui/theme';

applyTheme();
void new Workbench().start();
